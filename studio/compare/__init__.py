"""One rehearsal held against another: figures, floor plans, films."""

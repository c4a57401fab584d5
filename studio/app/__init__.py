"""Windows of the studio, in Qt: model, shell, view and docks.

`window.py`: makes the window and runs it to its end.
"""

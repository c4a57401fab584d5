"""Documents: edited, kept, restored and dropped in.

`document.py` (and changes of it) `added_mesh.py`, `arranged.py` (what a rehearsal takes of it),
`document_file.py` `autosave.py`, `dropped.py` (what is dropped onto the window), `recent.py` (what
was opened lately).
"""

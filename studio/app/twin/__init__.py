"""The twin by hand: what is in the room, moved, thrown, added and annotated.

`edits.py` `additions.py` `sizes.py` (pure: the one way in which hands, forms and scripts change
it), `mesh_file.py` (meshes of files), `running_physics.py` `hand.py` (grab and throw), `dock.py`
`inspector.py`.
"""

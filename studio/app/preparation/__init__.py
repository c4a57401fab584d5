"""Rooms from videos and photos, and objects cut out of them, in processes of their own."""

"""What the main window's menus and keys do, a file a subject."""

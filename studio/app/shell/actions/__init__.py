"""Actions of the main window's menus and keys, a file a subject."""

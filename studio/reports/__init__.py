"""Pages and films that sessions and preparations leave behind."""

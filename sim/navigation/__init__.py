"""Where people can walk: the free floor of a room, and ways on it."""

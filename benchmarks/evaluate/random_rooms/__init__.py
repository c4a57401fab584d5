"""The tracker in rooms that nobody chose: arrangements, a carried object, exact truth."""

"""Evidence of one frame about one object, and the object's rendering there."""

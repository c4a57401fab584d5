"""What objects collide with: a room's boxes, or patches fitted to a scanned surface."""

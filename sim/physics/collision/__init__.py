"""Static collision geometry: a room's boxes, or patches fitted to a scanned surface."""

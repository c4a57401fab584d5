"""A folder of photos, 360° pictures and exact truth, taken through prepare, cut and track."""

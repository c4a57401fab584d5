"""One object from frame to frame: rest, motion, occlusion, loss and re-detection."""

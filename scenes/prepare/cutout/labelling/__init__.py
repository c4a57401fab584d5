"""Labels of splats: the object, by surfaces that photos agree about, or by votes of few views."""

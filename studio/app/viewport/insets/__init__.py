"""Small pictures over the view: what the camera, a person or an object sees."""

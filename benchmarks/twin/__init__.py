"""How fast and how exact the digital twin is: camera, physics, forks."""

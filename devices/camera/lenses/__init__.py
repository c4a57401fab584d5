"""Pictures of a stream to pictures of lenses."""

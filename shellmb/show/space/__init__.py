"""Bodies in space: scenes, shapes, colours, views, animations, pages."""

"""Work that takes longer than a page: asked for by a form, done by a process of its own, one at a time."""

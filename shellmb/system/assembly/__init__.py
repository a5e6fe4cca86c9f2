"""The block system: fields, numbering, loops in C over cells and nodes."""

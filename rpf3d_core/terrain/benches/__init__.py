"""A parametric slope of bench faces and berms: a catch-bench design that needs no mesh."""

"""How things are shown while and after they are computed: notebook, progress, tables of text."""

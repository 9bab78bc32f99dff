"""What is kept whole: files, tables with units, arrays that nobody changes."""

"""Presentation of the studies: words, tables for the terminal, pictures, pages and forms."""

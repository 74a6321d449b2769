"""What stands in the panels as HTML: words, tables, charts and the style sheet; pure functions."""

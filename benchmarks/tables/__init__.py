"""Tables of docs/measured, made of rows of CSV files; `scripts/measured` writes them."""

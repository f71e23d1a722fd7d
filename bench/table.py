# SPDX-License-Identifier: Apache-2.0
"""Tables that read in a terminal and are Markdown, row by row as they come."""


class Table:
    """Columns are titles, or (title, width): at least so wide, below 0 to the left. The first is to the left in any case."""

    def __init__(self, *columns):
        columns = [column if isinstance(column, tuple) else (column, 0) for column in columns]
        self.left = [n == 0 or width < 0 for n, (_, width) in enumerate(columns)]
        self.widths = [max(len(title), abs(width), 3) for title, width in columns]
        print()
        self.row(*(title for title, _ in columns))
        print("|" + "|".join("-" * (width + 1) + ("-" if left else ":") for width, left in zip(self.widths, self.left)) + "|")

    def row(self, *cells):
        texts = ["" if cell is None else str(cell).replace("|", "\\|") for cell in cells]
        print("| " + " | ".join(text.ljust(width) if left else text.rjust(width) for text, width, left in zip(texts, self.widths, self.left)) + " |",
              flush=True)


def notes(lines):
    """Below a table: whatever is not of its columns."""
    for n, line in enumerate(lines):
        print(f"{'' if n else chr(10)}- {line}", flush=True)

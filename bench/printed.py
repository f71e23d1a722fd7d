# SPDX-License-Identifier: Apache-2.0
"""What benches printed, read again: their Markdown tables by the titles of columns and the first cells of rows."""
import re


class Printed:
    """`text`: everything that a bench wrote to standard output."""

    def __init__(self, text):
        self.rows = []  # (title: cell) of every row of every table
        titles = None
        for line in text.splitlines():
            cells = [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]] if line.startswith("|") else []
            if not cells:
                titles = None
            elif titles is None:
                titles = cells
            elif not all(re.fullmatch(r":?-+:?", cell) for cell in cells):
                self.rows.append(list(zip(titles, cells)))

    def number(self, first, column, exactly=False, **where):
        """As numbers(), where at most one row may match; None where there is none."""
        found = self.numbers(first, column, exactly, **where)
        if len(found) > 1:
            raise ValueError(f"{len(found)} rows begin with '{first}' and have a column '{column}'")
        return found[0] if found else None

    def numbers(self, first, column, exactly=False, **where):
        """Of each row whose first cell is or begins with `first`, and which holds what `where` says (title: cell), the number under the
        first column whose title begins with `column`; rows without one are left out."""
        out = []
        for cells in self.rows:
            name, said = cells[0][1], [under(cells, title) for title in where]
            if (name == first if exactly else name.startswith(first)) and said == [str(value) for value in where.values()]:
                number = re.match(r"-?[\d.]+", under(cells, column) or "")
                out += [float(number.group())] if number else []
        return out


def under(cells, column):
    return next((cell for title, cell in cells if title.startswith(column)), None)

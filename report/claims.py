# SPDX-License-Identifier: MIT
"""
claims - what the report's text concludes and states, held against its data. A conclusion is an expression over the CSV
files; the text of it takes its figures from there, in braces: {worst('chain_errors', 'behind_share', value='heard')} or,
with a format, {100 * v(...)|.2g}. Knows no page and no program.
"""
import csv
import math
import os
import re
import statistics

from page import number


class Missing(ValueError):
    """No row has what was asked for: a quick run measures less."""


class Claims:
    def __init__(self, data):
        self.data = data
        self.read = {}

    # ---- what expressions may say; data: the CSV file's name; where: columns and the text in them ----

    def rows(self, data, **where):
        if data not in self.read:
            with open(os.path.join(self.data, data + ".csv"), newline="", encoding="utf-8") as f:
                self.read[data] = list(csv.DictReader(f))
        found = [r for r in self.read[data] if all(r[k] == str(v) for k, v in where.items())]
        if not found:
            raise Missing(f"{data}: no row with {where}")
        return found

    def column(self, data, name, **where):
        return [float(r[name]) for r in self.rows(data, **where)]

    def v(self, data, name, **where):
        """The value of the one row."""
        values = self.column(data, name, **where)
        if len(values) != 1:
            raise ValueError(f"{data}: {len(values)} rows with {where}, want one")
        return values[0]

    def worst(self, data, name, **where):
        return max(self.column(data, name, **where))

    def least(self, data, name, **where):
        return min(self.column(data, name, **where))

    def median(self, data, name, **where):
        return statistics.median(self.column(data, name, **where))

    def total(self, data, name, **where):
        return sum(self.column(data, name, **where))

    def seeds(self, data, name, **where):
        """In how many rows it is above 0, as "3 of 8"."""
        values = self.column(data, name, **where)
        return f"{sum(v > 0 for v in values)} of {len(values)}"

    def among(self, data, key, **where):
        """The texts in a column, each once."""
        return list(dict.fromkeys(r[key] for r in self.rows(data, **where)))

    # ---- ----

    def words(self):
        names = ("rows", "column", "v", "worst", "least", "median", "total", "seeds", "among")
        return {name: getattr(self, name) for name in names} | {
            "__builtins__": {"float": float, "all": all, "any": any, "len": len, "max": max, "min": min, "round": round, "abs": abs, "sum": sum, "zip": zip},
            "upper": upper}

    def value(self, expression):
        try:
            return eval(expression, self.words())  # pylint: disable=eval-used
        except Missing:
            raise
        except Exception as fault:
            raise ValueError(f"{expression}: {fault}") from fault

    def holds(self, expression):
        return bool(self.value(expression))

    def filled(self, text):
        """The text with its figures."""
        def figure(match):
            value = self.value(match[1])
            return format(value, match[2]) if match[2] else number(str(value))
        return re.sub(r"\{([^{}|]+)(?:\|([^{}]*))?\}", figure, text)


def upper(found, of, z=1.96):
    """The upper end of Wilson's 95 % interval of a share: what `found` of `of` cases say at most."""
    return interval(found, of, z)[1]


def interval(found, of, z=1.96):
    if of == 0:
        return 0.0, 1.0
    p = found / of
    middle, half = p + z * z / (2 * of), z * math.sqrt(p * (1 - p) / of + z * z / (4 * of * of))
    return max(0.0, (middle - half) / (1 + z * z / of)), min(1.0, (middle + half) / (1 + z * z / of))

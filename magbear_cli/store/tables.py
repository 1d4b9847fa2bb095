"""The tables of a case as branches, and back: one dataset a column, and beside them what each column is."""

from __future__ import annotations

from magbear_cli.model.table import Column, Table
from magbear_cli.store.layout import COLUMN, TABLE_TITLE, Field
from magbear_cli.store.tree import Branch, grow_fields, harvest_fields


def grow_table(table: Table) -> Branch:
    """The branch of a table; its first column is the scale of the others."""
    axis = table.columns[0].name
    fields = [Field(column.name, column.long_name, column.unit, (axis,)) for column in table.columns]
    values = {column.name: column.values for column in table.columns}
    signal = table.columns[-1].name
    grown = grow_fields(fields, values, {"NX_class": "NXdata", "signal": signal, "axes": axis})
    told = {
        "name": [column.name for column in table.columns],
        "unit": [column.unit for column in table.columns],
        "long_name": [column.long_name for column in table.columns],
    }
    title = grow_fields(TABLE_TITLE, {"title": table.long_name})
    children = {**grown.children, **title.children, "columns": grow_fields(COLUMN, told)}
    return Branch(children, grown.attributes)


def harvest_table(branch: Branch) -> Table:
    """The table of a branch: the inverse of ``grow_table``.

    Raises
    ------
    KeyError, TypeError, ValueError
        when the branch does not hold a table.
    """
    told = harvest_fields(COLUMN, branch.branch("columns"))
    fields = [Field(name, "", axes=(name,)) for name in told["name"]]
    values = harvest_fields(fields, branch)
    columns = tuple(
        Column(name, values[name], unit, long_name)
        for name, unit, long_name in zip(told["name"], told["unit"], told["long_name"], strict=True)
    )
    return Table(columns, harvest_fields(TABLE_TITLE, branch)["title"])

"""Lists of orders that the mill can carry out."""

from collections.abc import Sequence

from .order_lines import Kind, Order

__all__ = ["begin_raised", "check_cuts"]


def begin_raised(orders: Sequence[Order]) -> list[Order]:
    """Return orders that begin with raising the tool, as a job must: with one more if need be."""
    up = [] if orders and orders[0].kind == Kind.UP else [Order(Kind.UP)]
    return [*up, *orders]


def check_cuts(orders: Sequence[Order]) -> None:
    """Refuse what the mill would refuse in the middle of the job.

    Raises
    ------
    ValueError
        If the tool is lowered and told to go where none of the 8 directions leads; or lowered where
        the job before left it, which is unknown here.
    """
    lowered, at = False, None
    for number, order in enumerate(orders, start=1):
        if order.kind != Kind.GO:
            lowered = order.kind == Kind.DOWN
            if lowered and at is None:
                raise ValueError(f"order {number}, {order}: the place is unknown; first go to "
                                 "where the cut begins")
            continue
        if lowered and at is not None:
            way = {abs(order.x - at[0]), abs(order.y - at[1])}
            if len(way - {0}) > 1:
                raise ValueError(f"order {number}, {order}: from {at[0]} {at[1]} no straight line "
                                 "of 8 directions leads there, and the tool is down")
        at = (order.x, order.y)

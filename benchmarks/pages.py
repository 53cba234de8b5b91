"""What benchmarks write into pages of docs/."""

__all__ = ["with_figures"]


def with_figures(page: str, name: str, found: str) -> str:
    """Return a page with what benchmark `name` has found between its two comments.

    Parameters
    ----------
    page : str
        Text in Markdown, with a line ``<!-- table of python -m benchmarks.NAME -->``, and
        ``<!-- end of the table -->`` behind it.
    name : str
        Module of the benchmark.
    found : str
        Lines, such as those of a table.

    Raises
    ------
    ValueError
        If the page has no such comments.
    """
    begin, end = f"<!-- table of python -m benchmarks.{name} -->\n", "<!-- end of the table -->"
    before, begins, rest = page.partition(begin)
    _, ends, after = rest.partition(end)
    if not (begins and ends):
        raise ValueError(f"the page has no place for the table of benchmarks.{name}")
    return f"{before}{begin}{found}{end}{after}"

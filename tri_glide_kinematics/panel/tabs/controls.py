"""Which of several pages has the controls."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Controls:
    """The page that has the controls, and the one that asks for them.

    The first page has them until it gives them up or vanishes. Then the page that asks gets them.
    If none does, a page has to take them: nobody who only looks on is made the operator.

    Attributes:
        holder: number of the page that has them, None if nobody does.
        asking: pages that ask the holder for them, the first one first.
        pages: all that are open, the oldest first.
    """

    holder: int | None = None
    asking: list[int] = field(default_factory=list)
    pages: list[int] = field(default_factory=list)

    def opened(self, page: int) -> None:
        """Note that a ``page`` is there; alone, it gets the controls."""
        if page in self.pages:
            return
        self.pages.append(page)
        if len(self.pages) == 1:
            self.holder = page

    def closed(self, page: int) -> None:
        """Note that a ``page`` has vanished: if it had the controls, whoever asks gets them."""
        self._forget(page)
        if page in self.pages:
            self.pages.remove(page)
        self.give(page)

    def ask(self, page: int) -> bool:
        """Take the controls if nobody has them, or ask for them; return whether they are taken."""
        if page not in self.pages:
            return False
        if self.holder is None:
            self.holder = page
            self._forget(page)
        elif self.holder != page and page not in self.asking:
            self.asking.append(page)
        return self.holder == page

    def give(self, page: int) -> None:
        """Give the controls of a ``page`` to the first that asks, or to nobody."""
        if self.holder == page:
            self.holder = self.asking.pop(0) if self.asking else None

    def _forget(self, page: int) -> None:
        if page in self.asking:
            self.asking.remove(page)


def name_of(page: int) -> str:
    """Return what a page is called on all of them."""
    return f"page {page + 1}"

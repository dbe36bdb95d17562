"""The help: a list of pages, a search through all of them, and the page that is read."""

from __future__ import annotations

from collections.abc import Sequence

from flyreg_resources import read_help
from PySide6.QtCore import Qt
from PySide6.QtGui import QTextCursor
from PySide6.QtWidgets import (
    QDialog,
    QLineEdit,
    QListWidget,
    QSplitter,
    QTextBrowser,
    QVBoxLayout,
    QWidget,
)

PAGES = (
    ("Brains", "brains.md"),
    ("Preparing", "preparing.md"),
    ("Looking", "looking.md"),
    ("Landmarks", "landmarks.md"),
    ("Weights and λ", "weights.md"),
    ("Judging", "judging.md"),
    ("Taking away", "exporting.md"),
    ("When something goes wrong", "trouble.md"),
    ("About the method", "method.md"),
)
MOUSE_AND_KEYS = "Mouse and keys"


def help_pages(keys: str) -> list[tuple[str, str]]:
    """Return all pages, title and Markdown; `keys` is the table of keys as they are now."""
    mouse = f"{read_help('shortcuts.md')}\n## Keys\n\n{keys}\n"
    return [*((title, read_help(name)) for title, name in PAGES), (MOUSE_AND_KEYS, mouse)]


class HelpWindow(QDialog):
    """Help beside the work: it does not have to be closed first."""

    def __init__(self, pages: Sequence[tuple[str, str]], title: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Help")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._pages = dict(pages)
        self.search = QLineEdit()
        self.search.setPlaceholderText("Search all pages")
        self.search.setClearButtonEnabled(True)
        self.search.setAccessibleName("Search all pages")
        self.list = QListWidget()
        self.list.setAccessibleName("Pages")
        self.text = QTextBrowser()
        self.text.setOpenExternalLinks(True)
        self.text.setAccessibleName("Page")
        left = QWidget()
        column = QVBoxLayout(left)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.search)
        column.addWidget(self.list)
        split = QSplitter()
        split.addWidget(left)
        split.addWidget(self.text)
        split.setChildrenCollapsible(False)
        split.setStretchFactor(1, 1)
        split.setSizes([210, 560])
        layout = QVBoxLayout(self)
        layout.addWidget(split)
        self.search.textChanged.connect(self._on_search)
        self.list.currentTextChanged.connect(self._show)
        self.resize(820, 640)
        self._fill(title)

    def _fill(self, title: str) -> None:
        """List the pages in which what is searched for stands, and open one."""
        words = self.search.text().casefold()
        found = [
            name
            for name, text in self._pages.items()
            if words in name.casefold() or words in text.casefold()
        ]
        self.list.clear()
        self.list.addItems(found)
        if found:
            self.list.setCurrentRow(found.index(title) if title in found else 0)
        else:
            self.text.setMarkdown(f"Nothing about “{self.search.text()}” on any page.")

    def _on_search(self) -> None:
        item = self.list.currentItem()
        self._fill(item.text() if item is not None else "")

    def _show(self, title: str) -> None:
        if title:
            self.text.setMarkdown(self._pages[title])
            self.text.moveCursor(QTextCursor.MoveOperation.Start)
            if self.search.text():
                self.text.find(self.search.text())

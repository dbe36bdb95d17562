"""The list of tunnels, and what the user can say about them."""

from __future__ import annotations

from PySide6.QtCore import QItemSelectionModel, Qt, Signal
from PySide6.QtGui import QColor, QIcon, QPixmap
from PySide6.QtWidgets import (
    QAbstractItemView,
    QGridLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from flyreg_core.frame import BrainFrame
from flyreg_core.handles import Handle
from flyreg_core.project import Role
from flyreg_gui.preparing import ROLES
from flyreg_gui.session import Session
from flyreg_gui.tunnels import Chosen, Tunnels, description_of, name_of, place_of
from flyreg_gui.views.rings import color_of

ROLE_OF_ITEM, NUMBER_OF_ITEM = Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 1
HEADERS = ("Tunnel", "Width", "Place, µm")
TIPS = (
    "The widest first; ? marks a guess",
    "At its narrowest place, micrometres",
    "Left or right of the midplane, ventral or dorsal, and posterior or anterior of the middle",
)
KEY_SIZE = 10


class TunnelsPanel(QWidget):
    """Shows the tunnels of both brains down, sends what the user says about them up."""

    drill_asked = Signal()

    def __init__(self, session: Session, tunnels: Tunnels) -> None:
        super().__init__()
        self._session, self._tunnels = session, tunnels
        self._is_showing = False
        self._items: dict[Chosen, QTreeWidgetItem] = {}
        self.list = QTreeWidget()
        self.list.setAccessibleName("Tunnels")
        self.list.setHeaderLabels(HEADERS)
        self.list.setIndentation(10)
        self.list.setRootIsDecorated(False)
        self.list.setItemsExpandable(False)
        self.list.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.list.setSizeAdjustPolicy(QTreeWidget.SizeAdjustPolicy.AdjustToContents)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        header = self.list.header()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setStretchLastSection(True)
        for column, tip in enumerate(TIPS):
            self.list.headerItem().setToolTip(column, tip)
        self.about = QLabel()
        self.about.setWordWrap(True)
        self.take_button = QPushButton("This is the oesophagus")
        self.refuse_button = QPushButton("Not this one")
        self.drill_button = QPushButton("Drill a channel")
        self.reset_button = QPushButton("Back to automatic")
        self._arrange()
        self._connect()
        self._show()

    def _arrange(self) -> None:
        self.take_button.setToolTip("Keep the selected tunnel open and close all others")
        self.refuse_button.setToolTip("Have the program choose among the other tunnels")
        self.drill_button.setToolTip("Click where it begins at the front, then at the back (D)")
        self.reset_button.setToolTip("Forget what was said about the tunnels of both brains")
        buttons = QGridLayout()
        buttons.setSpacing(4)
        buttons.addWidget(self.take_button, 0, 0, 1, 2)
        buttons.addWidget(self.refuse_button, 1, 0)
        buttons.addWidget(self.drill_button, 1, 1)
        buttons.addWidget(self.reset_button, 2, 0, 1, 2)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 4, 0, 4)
        layout.addWidget(self.list)
        layout.addWidget(self.about)
        layout.addLayout(buttons)

    def _connect(self) -> None:
        self.list.itemSelectionChanged.connect(self._on_selected)
        self.take_button.clicked.connect(self._tunnels.take)
        self.refuse_button.clicked.connect(self._tunnels.refuse)
        self.drill_button.clicked.connect(self.drill_asked)
        self.reset_button.clicked.connect(self._tunnels.reset)
        self._tunnels.changed.connect(self._show)
        self._session.project_changed.connect(self._show_whether_reset)

    def item(self, role: Role, number: int) -> QTreeWidgetItem:
        """Return the row of a tunnel."""
        return self._items[role, number]

    def _on_selected(self) -> None:
        if self._is_showing:
            return
        items = self.list.selectedItems()
        number = items[0].data(0, NUMBER_OF_ITEM) if items else None
        role = items[0].data(0, ROLE_OF_ITEM) if items else None
        self._tunnels.choose(None if number is None or role is None else (role, number))

    def _show(self, *_news: object) -> None:
        self._is_showing = True
        self.list.clear()
        self._items = {}
        for role in ROLES:
            self._show_brain(role)
        chosen, tunnel = self._tunnels.chosen, self._tunnels.tunnel
        if chosen is not None:
            self.list.setCurrentItem(
                self.item(*chosen), 0, QItemSelectionModel.SelectionFlag.ClearAndSelect
            )
        self._is_showing = False
        brain = self._session.brain(chosen[0]) if chosen else None
        self.about.setText(
            description_of(tunnel, brain.frame, brain.is_guess)
            if tunnel is not None and brain is not None
            else "Select a tunnel here or in the view of its brain."
        )
        is_sure = tunnel is not None and tunnel.is_oesophagus and not (brain and brain.is_guess)
        self.take_button.setEnabled(tunnel is not None and not is_sure)
        self.refuse_button.setEnabled(tunnel is not None)
        self.drill_button.setEnabled(self._session.brain("source") is not None)
        self._show_whether_reset()

    def _show_whether_reset(self, *_news: object) -> None:
        self.reset_button.setEnabled(self._tunnels.can_reset)

    def _show_brain(self, role: Role) -> None:
        brain = self._session.brain(role)
        heading = QTreeWidgetItem([role.capitalize()])
        heading.setFlags(Qt.ItemFlag.ItemIsEnabled)
        font = heading.font(0)
        font.setBold(True)
        heading.setFont(0, font)
        self.list.addTopLevelItem(heading)
        heading.setExpanded(True)
        if brain is None or not brain.tunnels:
            remains = self._session.remains
            is_left = brain is not None and (remains is None or remains.role != role)
            why = "not prepared yet" if brain is None or is_left else "none found"
            heading.setText(0, f"{role.capitalize()}: {why}")
            heading.setFirstColumnSpanned(True)
            return
        for number, tunnel in enumerate(brain.tunnels):
            child = _row(tunnel, number + 1, brain.is_guess, brain.frame)
            child.setData(0, ROLE_OF_ITEM, role)
            child.setData(0, NUMBER_OF_ITEM, number)
            heading.addChild(child)
            self._items[role, number] = child


def _row(tunnel: Handle, number: int, is_guess: bool, frame: BrainFrame) -> QTreeWidgetItem:
    name = name_of(tunnel, number, is_guess)
    row = QTreeWidgetItem([name, f"{tunnel.width_um:.0f}", place_of(tunnel, frame)])
    key = QPixmap(KEY_SIZE, KEY_SIZE)
    key.fill(QColor(*color_of(tunnel)))
    row.setIcon(0, QIcon(key))
    clear = f"The brain is {tunnel.clearness:.0%} thinner there than elsewhere on the midline"
    tip = f"{description_of(tunnel, frame, is_guess)}\n{clear}"
    for column in range(len(HEADERS)):
        row.setToolTip(column, tip)
    return row

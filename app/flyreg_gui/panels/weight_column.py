"""The table's view: the weight column is a row of sliders that are dragged where they are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from PySide6.QtCore import (
    QAbstractItemModel,
    QModelIndex,
    QPersistentModelIndex,
    QRect,
    QRectF,
    QSize,
    Qt,
    Signal,
)
from PySide6.QtGui import QAction, QDoubleValidator, QMouseEvent, QPainter, QPaintEvent, QPalette
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QLineEdit,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableView,
    QWidget,
)

from flyreg_gui.landmark_table import ID_ROLE, Column
from flyreg_gui.sliders import WEIGHT_SCALE

Index = QModelIndex | QPersistentModelIndex

WEIGHT_WIDTH = 112
PADDING, SWATCH = 8, 10
NUMBER_WIDTH = 46
INSET = 9
EMPTY = "The landmarks of both brains are listed here once the brains are prepared."
GROOVE, HANDLE = 3.0, 5.0


def groove_of(cell: QRect) -> QRectF:
    """Return where the groove of the slider lies in a cell of the weight column."""
    width = max(cell.width() - NUMBER_WIDTH - 2 * INSET, 20)
    return QRectF(cell.x() + INSET, cell.center().y() - GROOVE / 2 + 0.5, width, GROOVE)


class NameDelegate(QStyledItemDelegate):
    """Tells of new names instead of putting them into the model."""

    renamed = Signal(str, str)  # id, name

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: Index) -> None:
        """Tell what was typed; the model changes when the project does."""
        self.renamed.emit(str(index.data(ID_ROLE)), str(editor.property("text")).strip())


class WeightDelegate(QStyledItemDelegate):
    """Draws a slider and the number; gives an editor for the number."""

    typed = Signal(str, float)  # id, weight

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Draw a slider and its number."""
        styled = QStyleOptionViewItem(option)
        self.initStyleOption(styled, index)
        number = QRect(styled.rect)
        number.setLeft(styled.rect.right() - NUMBER_WIDTH)
        text, styled.text = styled.text, ""
        style = styled.widget.style()
        style.drawControl(style.ControlElement.CE_ItemViewItem, styled, painter, styled.widget)
        is_selected = bool(styled.state & style.StateFlag.State_Selected)
        palette = styled.palette
        ink = palette.color(
            QPalette.ColorRole.HighlightedText if is_selected else QPalette.ColorRole.Text
        )
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        weight = float(index.data(Qt.ItemDataRole.EditRole))
        _paint_slider(painter, groove_of(styled.rect), weight, styled, is_selected)
        painter.setPen(ink)
        painter.drawText(number.adjusted(0, 0, -6, 0), _RIGHT, text)
        painter.restore()

    def createEditor(
        self, parent: QWidget, option: QStyleOptionViewItem, index: Index
    ) -> QLineEdit:
        """Return a field that takes weights only."""
        editor = QLineEdit(parent)
        editor.setValidator(QDoubleValidator(0.0, 1e6, 6, editor))
        return editor

    def setEditorData(self, editor: QWidget, index: Index) -> None:
        """Put the present weight into the field."""
        editor.setProperty("text", f"{index.data(Qt.ItemDataRole.EditRole):g}")

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: Index) -> None:
        """Tell what was typed; the model changes when the project does."""
        self.typed.emit(str(index.data(ID_ROLE)), float(str(editor.property("text"))))


_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


def _paint_slider(
    painter: QPainter, groove: QRectF, weight: float, option: QStyleOptionViewItem, selected: bool
) -> None:
    palette = option.palette
    handle = palette.color(
        QPalette.ColorRole.HighlightedText if selected else QPalette.ColorRole.Highlight
    )
    line = palette.color(
        QPalette.ColorRole.HighlightedText if selected else QPalette.ColorRole.Text
    )
    line.setAlphaF(0.5 if selected else 0.25)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(line)
    painter.drawRoundedRect(groove, GROOVE / 2, GROOVE / 2)
    x = groove.left() + WEIGHT_SCALE.share(weight) * groove.width()
    filled = QRectF(groove)
    filled.setRight(x)
    painter.setBrush(handle)
    painter.drawRoundedRect(filled, GROOVE / 2, GROOVE / 2)
    if weight <= 0:
        painter.setBrush(palette.color(QPalette.ColorRole.Base))
        painter.setPen(line)
    painter.drawEllipse(QRectF(x - HANDLE, groove.center().y() - HANDLE, 2 * HANDLE, 2 * HANDLE))


class LandmarkTableView(QTableView):
    """The table; a press on a slider in the weight column drags it and selects nothing."""

    weight_drag_started = Signal(str)  # id
    weight_dragged = Signal(str, float)
    weight_drag_ended = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.weights, self.names = WeightDelegate(self), NameDelegate(self)
        self.setItemDelegateForColumn(Column.WEIGHT, self.weights)
        self.setItemDelegateForColumn(Column.NAME, self.names)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setEditTriggers(QAbstractItemView.EditTrigger.DoubleClicked)
        self.setSortingEnabled(True)
        self.setShowGrid(False)
        self.setAlternatingRowColors(True)
        self.setWordWrap(False)
        self.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        self.setTabKeyNavigation(False)
        self.verticalHeader().hide()
        self.setIconSize(QSize(SWATCH, SWATCH))
        self.verticalHeader().setDefaultSectionSize(self.fontMetrics().height() + 8)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._dragged: QPersistentModelIndex | None = None

    def arrange_columns(self) -> None:
        """Give each column the room it needs; the sliders take the rest."""
        header = self.horizontalHeader()
        header.setHighlightSections(False)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        header.setMinimumSectionSize(48)
        header.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)
        for column in (Column.PLACE, Column.RESIDUAL, Column.FORETOLD, Column.LEVERAGE):
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.Interactive)
            title = str(self.model().headerData(column, Qt.Orientation.Horizontal))
            texts = ("⚠ 00.00" if column == Column.FORETOLD else "000.00", *title.splitlines())
            wide = max(self.fontMetrics().horizontalAdvance(text) for text in texts)
            header.resizeSection(column, wide + PADDING)
            action = QAction(title.replace("\n", ", "), header, checkable=True)
            action.setChecked(column != Column.PLACE)
            action.toggled.connect(partial(self._show_column, column))
            header.addAction(action)
        self.setColumnHidden(Column.PLACE, True)
        header.setSectionResizeMode(Column.NAME, QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(Column.WEIGHT, QHeaderView.ResizeMode.Fixed)
        header.resizeSection(Column.WEIGHT, WEIGHT_WIDTH)

    def dataChanged(  # type: ignore[override]  # Qt hands over no other kind of index
        self, first: QModelIndex, last: QModelIndex, roles: Sequence[int] = ()
    ) -> None:
        """Draw what changed of what is in sight; of a range that reaches farther Qt draws all."""
        top, bottom = self.rowAt(0), self.rowAt(self.viewport().height() - 1)
        bottom = bottom if bottom >= 0 else self.model().rowCount() - 1
        upper, lower = max(first.row(), top), min(last.row(), bottom)
        if upper <= lower:
            super().dataChanged(first.siblingAtRow(upper), last.siblingAtRow(lower), roles)

    def keyboardSearch(self, search: str) -> None:
        """Go nowhere: some letters are keys of actions, and the others would change the selection."""

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the table, or what will be in it."""
        super().paintEvent(event)
        if self.model().rowCount() == 0:
            with QPainter(self.viewport()) as painter:
                painter.setPen(self.palette().color(QPalette.ColorRole.PlaceholderText))
                room = self.viewport().rect().adjusted(PADDING, PADDING, -PADDING, -PADDING)
                how = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
                painter.drawText(room, how, EMPTY)

    def _show_column(self, column: Column, on: bool) -> None:
        self.setColumnHidden(column, not on)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin to drag the slider under the mouse, or select."""
        index = self._slider_at(event)
        if index is None or event.button() != Qt.MouseButton.LeftButton:
            super().mousePressEvent(event)
            return
        self._dragged = QPersistentModelIndex(index)
        self.weight_drag_started.emit(str(index.data(ID_ROLE)))
        self._drag(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the slider that was pressed."""
        if self._dragged is not None:
            self._drag(event)
        else:
            super().mouseMoveEvent(event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go of the slider."""
        if self._dragged is not None:
            self._dragged = None
            self.weight_drag_ended.emit()
        else:
            super().mouseReleaseEvent(event)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Take a double click on a slider as two presses."""
        if self._slider_at(event) is not None:
            self.mousePressEvent(event)
        else:
            super().mouseDoubleClickEvent(event)

    def _slider_at(self, event: QMouseEvent) -> QModelIndex | None:
        index = self.indexAt(event.position().toPoint())
        if not index.isValid() or index.column() != Column.WEIGHT:
            return None
        groove = groove_of(self.visualRect(index))
        x = event.position().x()
        return index if groove.left() - HANDLE <= x <= groove.right() + HANDLE else None

    def _drag(self, event: QMouseEvent) -> None:
        index = self._dragged
        if index is None or not index.isValid():
            return
        cell = self.visualRect(self.model().index(index.row(), Column.WEIGHT))
        groove = groove_of(cell)
        share = (event.position().x() - groove.left()) / groove.width()
        self.weight_dragged.emit(str(index.data(ID_ROLE)), WEIGHT_SCALE.value_at(share))

"""Asks which model to spawn, and under which name."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from PyQt5.QtCore import pyqtSignal
from PyQt5.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from flatland.viewer.naming import model_name, numbered


@dataclass(frozen=True, slots=True)
class SpawnChoice:
    """What to spawn.

    Attributes:
        path: The model file.
        name: Of the model, and of its namespace.
        base: The name without its number.
        number: Whether the name was to end with a running number.
    """

    path: str = ""
    name: str = ""
    base: str = ""
    number: bool = False


class SpawnDialog(QDialog):
    """A dialog that stays open until it is answered; the window lives on meanwhile."""

    chosen = pyqtSignal(object)  # SpawnChoice

    def __init__(
        self, parent: QWidget, last: SpawnChoice, folder: str, taken: Collection[str]
    ) -> None:
        """Makes the dialog.

        Args:
            parent: The window.
            last: What was chosen the last time.
            folder: Of the world file: where relative paths start, and the search at first.
            taken: Names that models have already.
        """
        super().__init__(parent)
        self.setWindowTitle("Spawn model")
        self._folder = folder
        self._taken = taken
        self.path = QLineEdit(last.path)
        self.path.setObjectName("path")
        self.path.setMinimumWidth(360)
        self.path.setPlaceholderText("a model file (.yaml)")
        self.name = QLineEdit()
        self.name.setObjectName("name")
        self.number = QCheckBox("number")
        self.number.setObjectName("number")
        self.number.setToolTip("append a running number to the name")
        self.number.setChecked(last.number)
        self._base = last.base
        self.buttons = QDialogButtonBox()
        self.buttons.addButton(QDialogButtonBox.StandardButton.Ok)
        self.buttons.addButton(QDialogButtonBox.StandardButton.Cancel)
        self._lay_out()
        self.path.textChanged.connect(self._suggest_name)
        self.number.toggled.connect(self._show_name)
        self.name.textEdited.connect(self._take_name)
        self.name.editingFinished.connect(self._show_name)
        self.name.textChanged.connect(self._check)
        self.buttons.accepted.connect(self._accept)
        self.buttons.rejected.connect(self.reject)
        self._show_name()
        self._check()

    def _lay_out(self) -> None:
        browse = QPushButton("Choose …")
        browse.setObjectName("browse")
        browse.clicked.connect(self._browse)
        file_row, name_row = QHBoxLayout(), QHBoxLayout()
        file_row.addWidget(self.path)
        file_row.addWidget(browse)
        name_row.addWidget(self.name)
        name_row.addWidget(self.number)
        form = QFormLayout()
        form.addRow("Model file", file_row)
        form.addRow("Name", name_row)
        layout = QVBoxLayout(self)
        layout.addLayout(form)
        layout.addWidget(self.buttons)

    def _browse(self) -> None:
        path, _ = QFileDialog.getOpenFileName(
            self, "Model file", self.path.text() or self._folder, "Models (*.yaml *.yml);;All (*)"
        )
        if path:
            self.path.setText(path)

    def _suggest_name(self) -> None:
        self._base = model_name(self.path.text())
        self._show_name()

    def _take_name(self, name: str) -> None:
        """Keeps what the user wrote."""
        self._base = name.strip()

    def _show_name(self) -> None:
        name = self._base
        if name and self.number.isChecked():
            name = numbered(name, self._taken)
        self.name.setText(name)

    def _check(self) -> None:
        complete = bool(self.path.text().strip() and self.name.text().strip())
        self.buttons.button(QDialogButtonBox.StandardButton.Ok).setEnabled(complete)

    def _accept(self) -> None:
        choice = SpawnChoice(
            str(Path(self._folder, Path(self.path.text().strip()).expanduser()).absolute()),
            self.name.text().strip(),
            self._base,
            self.number.isChecked(),
        )
        self.accept()
        self.chosen.emit(choice)

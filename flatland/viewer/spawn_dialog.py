"""The dialog for the file and the name of a model to spawn."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path, PurePath

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


def suggested_name(path: str) -> str:
    """Returns the default name of a model: its file name without the extension, `.` as `_`.

    The name is also used as a namespace, so all other characters that are invalid in ROS names
    are replaced by `_` too.
    """
    name = re.sub(r"\W", "_", PurePath(path).stem, flags=re.ASCII)
    return name if not name or name[0].isalpha() else f"m{name}"


def numbered_name(name: str, existing: Collection[str]) -> str:
    """Appends the lowest number, starting from 1, that makes the name unique."""
    number = 1
    while f"{name}{number}" in existing:
        number += 1
    return f"{name}{number}"


@dataclass(frozen=True, slots=True)
class SpawnChoice:
    """The input of the dialog.

    Attributes:
        path: Path of the model file.
        name: Name of the model and of its namespace.
        base_name: The name without its number.
        number: Whether a number was appended to the name.
    """

    path: str = ""
    name: str = ""
    base_name: str = ""
    number: bool = False


class SpawnDialog(QDialog):
    """A dialog to choose a model file and a model name."""

    chosen = pyqtSignal(object)  # SpawnChoice

    def __init__(
        self, parent: QWidget, previous: SpawnChoice, folder: str, existing: Collection[str]
    ) -> None:
        """Creates the dialog.

        Args:
            parent: The window.
            previous: The previous choice, shown initially.
            folder: Folder of the world file: base of relative paths, and where browsing starts.
            existing: Names of the existing models.
        """
        super().__init__(parent)
        self.setWindowTitle("Spawn model")
        self._folder = folder
        self._existing = existing
        self.path = QLineEdit(previous.path)
        self.path.setObjectName("path")
        self.path.setMinimumWidth(360)
        self.path.setPlaceholderText("Path of a model file (.yaml)")
        self.name = QLineEdit()
        self.name.setObjectName("name")
        self.number = QCheckBox("number")
        self.number.setObjectName("number")
        self.number.setToolTip("Append the next free number to the name")
        self.number.setChecked(previous.number)
        self._base_name = previous.base_name
        self.buttons = QDialogButtonBox()
        self.buttons.addButton(QDialogButtonBox.StandardButton.Ok)
        self.buttons.addButton(QDialogButtonBox.StandardButton.Cancel)
        self._create_layout()
        self.path.textChanged.connect(self._suggest_name)
        self.number.toggled.connect(self._update_name)
        self.name.textEdited.connect(self._on_name_edited)
        self.name.editingFinished.connect(self._update_name)
        self.name.textChanged.connect(self._update_ok_button)
        self.buttons.accepted.connect(self._accept)
        self.buttons.rejected.connect(self.reject)
        self._update_name()
        self._update_ok_button()

    def set_existing(self, existing: Collection[str]) -> None:
        """Sets the names of the existing models; a name that is being edited is kept."""
        self._existing = existing
        if not self.name.hasFocus():
            self._update_name()

    def _create_layout(self) -> None:
        browse = QPushButton("Browse…")
        browse.setObjectName("browse")
        browse.clicked.connect(self._browse)
        file_row, name_row = QHBoxLayout(), QHBoxLayout()
        file_row.addWidget(self.path)
        file_row.addWidget(browse)
        name_row.addWidget(self.name)
        name_row.addWidget(self.number)
        form = QFormLayout()
        form.addRow("Model file:", file_row)
        form.addRow("Name:", name_row)
        layout = QVBoxLayout(self)
        layout.addLayout(form)
        layout.addWidget(self.buttons)

    def _browse(self) -> None:
        path, _ = QFileDialog.getOpenFileName(
            self,
            "Select model file",
            self.path.text() or self._folder,
            "Model files (*.yaml *.yml);;All files (*)",
        )
        if path:
            self.path.setText(path)

    def _suggest_name(self) -> None:
        self._base_name = suggested_name(self.path.text())
        self._update_name()

    def _on_name_edited(self, name: str) -> None:
        self._base_name = name.strip()

    def _update_name(self) -> None:
        name = self._base_name
        if name and self.number.isChecked():
            name = numbered_name(name, self._existing)
        self.name.setText(name)

    def _update_ok_button(self) -> None:
        complete = bool(self.path.text().strip() and self.name.text().strip())
        self.buttons.button(QDialogButtonBox.StandardButton.Ok).setEnabled(complete)

    def _accept(self) -> None:
        choice = SpawnChoice(
            str(Path(self._folder, Path(self.path.text().strip()).expanduser()).absolute()),
            self.name.text().strip(),
            self._base_name,
            self.number.isChecked(),
        )
        self.accept()
        self.chosen.emit(choice)

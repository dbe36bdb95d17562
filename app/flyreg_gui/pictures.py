"""Pictures of the views: of one, of all, and of a brain that turns."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image
from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtGui import QImage, QPixmap
from PySide6.QtWidgets import QProgressDialog

from flyreg_core.errors import Cancelled, FlyregError
from flyreg_core.files import make_folder
from flyreg_gui.dialogs import ask_for_saving_path
from flyreg_gui.failures import sentence_for
from flyreg_gui.views.graphics import PRINT, samples_per_pixel
from flyreg_gui.views.view_frame import ViewFrame

if TYPE_CHECKING:
    from flyreg_gui.main_window import MainWindow

PICTURE_FILTER = "PNG (*.png)"
TURN_FILTER = "Animated GIF (*.gif);;Folder of PNG pictures (*.png)"
FRAMES = 72
"""Pictures of one whole turn, 5 degrees each."""
FRAME_MS = 50

Tell = Callable[[int], None]
"""Called with how many frames are done; raises `Cancelled` to stop."""


class PictureCommands:
    """What File > Picture does."""

    def __init__(self, window: MainWindow) -> None:
        self._window = window

    def save_window(self) -> None:
        """Save a picture of the whole window."""
        self._save(self._window.picture(), "flyreg.png")

    def save_all_views(self) -> None:
        """Save a picture of all views, without what is around them."""
        area = self._window.view_area
        self._save(self._in_print(area.grab), "views.png")

    def save_view(self) -> None:
        """Save a picture of the current view."""
        frame = self.current
        picture = self._in_print(lambda: QPixmap.fromImage(frame.canvas.grabFramebuffer()))
        self._save(picture, f"{name_of(frame)}.png")

    @property
    def current(self) -> ViewFrame:
        """The view that was clicked last; at first the one with the result."""
        focus = self._window.focusWidget()
        frames = self._window.view_area.frames
        shown = [frame for frame in frames if frame.isVisible()]
        if len(shown) == 1:
            return shown[0]
        return next((frame for frame in frames if frame.canvas is focus), frames[2])

    def save_turn(self) -> None:
        """Save the result turning once about its vertical axis."""
        frame = self.current
        if frame not in self._window.view_area.frames[:3]:
            frame = self._window.view_area.frames[2]
        folder = Path(self._window.preferences.folder)
        path = ask_for_saving_path(
            self._window, "Save a turning picture", folder / "turn.gif", TURN_FILTER, ".gif"
        )
        if path is None:
            return
        progress = QProgressDialog("Drawing a whole turn…", "Cancel", 0, FRAMES + 1, self._window)
        progress.setWindowTitle("Turning picture")
        progress.setWindowModality(Qt.WindowModality.WindowModal)
        progress.setMinimumDuration(0)

        def tell(done: int) -> None:
            progress.setValue(done)
            QCoreApplication.processEvents()
            if progress.wasCanceled():
                raise Cancelled

        try:
            write_turn(frame, path, tell, FRAMES)
        except Cancelled:
            self._window.say("The turning picture was not saved")
        except (FlyregError, OSError) as error:
            self._window.show_problem(sentence_for(error))
        else:
            self._window.say(f"Saved {path}")
        finally:
            progress.close()
            progress.deleteLater()

    def _in_print(self, draw: Callable[[], QPixmap]) -> QPixmap:
        """Draw with smooth edges, whatever that costs."""
        canvases = [frame.canvas for frame in self._window.view_area.frames]
        for canvas in canvases:
            canvas.set_samples(PRINT)
        picture = draw()
        for canvas in canvases:
            canvas.set_samples(samples_per_pixel())
        return picture

    def _save(self, picture: QPixmap, name: str) -> None:
        folder = Path(self._window.preferences.folder)
        path = ask_for_saving_path(
            self._window, "Save a picture", folder / name, PICTURE_FILTER, ".png"
        )
        if path is None:
            return
        if picture.save(str(path)):
            self._window.say(f"Saved {path}")
        else:
            self._window.show_problem(f"{path} cannot be written; choose another folder")


def name_of(frame: ViewFrame) -> str:
    """Return a file name for a picture of a view."""
    return frame.canvas.accessibleName().lower().replace(",", "").replace(" ", "-")


def write_turn(frame: ViewFrame, path: Path, tell: Tell, frames: int) -> None:
    """Write a brain's whole turn: a GIF, or beside a .png's place a folder of numbered pictures.

    Raises
    ------
    FlyregError, OSError
        The place cannot be written.
    Cancelled
        `tell` said so; nothing is left then.
    """
    pictures = _turned(frame, frames, tell)
    if path.suffix.lower() != ".gif":
        folder = path.with_suffix("")
        make_folder(folder)
        written = []
        try:
            for number, picture in enumerate(pictures):
                written.append(folder / f"{number:03}.png")
                picture.save(written[-1])
        except Cancelled:
            for file in written:
                file.unlink(missing_ok=True)
            raise
        return
    first, *others = (picture.convert("P", palette=Image.Palette.ADAPTIVE) for picture in pictures)
    part = path.with_name(f".{path.name}.part")
    try:
        first.save(*(part, "GIF"), save_all=True, append_images=others, duration=FRAME_MS, loop=0)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _turned(frame: ViewFrame, frames: int, tell: Tell) -> Iterator[Image.Image]:
    camera = frame.canvas.renderer.GetActiveCamera()
    place, up = camera.GetPosition(), camera.GetViewUp()
    try:
        for number in range(frames):
            tell(number)
            yield _as_pillow(frame.canvas.grabFramebuffer())
            camera.Azimuth(360 / frames)
            frame.canvas.refresh()
    finally:
        camera.SetPosition(*place)
        camera.SetViewUp(*up)
        frame.canvas.refresh()


def _as_pillow(image: QImage) -> Image.Image:
    plain = image.convertToFormat(QImage.Format.Format_RGB888)
    size = (plain.width(), plain.height())
    return Image.frombytes(
        "RGB", size, bytes(plain.constBits()), "raw", "RGB", plain.bytesPerLine(), 1
    )

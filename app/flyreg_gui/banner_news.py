"""What the banner says by itself: that a registration failed, or that an oesophagus is a guess."""

from __future__ import annotations

from PySide6.QtCore import QObject

from flyreg_core.errors import TopologyError
from flyreg_core.results import Results
from flyreg_gui.panels.banner import Banner
from flyreg_gui.session import Session
from flyreg_gui.tunnels import Tunnels, guess_of

SHOW_TUNNELS = "Show the tunnels"


class BannerNews(QObject):
    """Tells each failure and each guess once, and takes it away when it is over."""

    def __init__(
        self, session: Session, tunnels: Tunnels, banner: Banner, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._session, self._tunnels, self._banner = session, tunnels, banner
        self._failure: object = None
        self._guess: object = None
        session.state_changed.connect(self._on_state)
        session.results_changed.connect(self._on_results)
        banner.asked.connect(self._on_asked)

    def _on_state(self) -> None:
        failure = self._session.failure
        if failure is self._failure:
            return
        self._failure = failure
        if failure is None:
            self._banner.show_sentence("")
        else:
            is_about_tunnels = isinstance(failure.error, TopologyError)
            self._banner.show_sentence(failure.sentence, SHOW_TUNNELS if is_about_tunnels else "")

    def _on_results(self, results: Results | None) -> None:
        self._on_state()
        guess = guess_of(results) if results is not None else None
        if guess == self._guess:
            return
        self._guess = guess
        if guess is not None:
            self._banner.show_sentence(guess[0], SHOW_TUNNELS)
        elif self._session.failure is None:
            self._banner.show_sentence("")

    def _on_asked(self) -> None:
        self._tunnels.set_on(True)
        self._banner.hide()

"""What the operating system lacks is found by looking, and named with what to do about it."""

import sys

import programs
import pytest
import system_packages


def test_a_library_that_no_system_has_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    if not sys.platform.startswith("linux"):
        pytest.skip("windows need system libraries on Linux only")
    monkeypatch.setattr(
        system_packages,
        "WINDOW_LIBRARIES",
        {"libno-such.so.1": "libno-such1", "libc.so.6": "libc6"},
    )
    assert system_packages.missing_for_windows(private=False) == {"libno-such.so.1": "libno-such1"}


def test_the_sentence_names_what_is_missing_and_the_command(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("shutil.which", lambda name: f"/usr/bin/{name}")
    with pytest.raises(programs.SetUpError) as caught:
        system_packages.require("a window", {"libEGL.so.1": "libegl1", "Xvfb": "xvfb"})
    assert str(caught.value) == (
        "a window needs what is not installed here: libEGL.so.1, Xvfb. Install it with: "
        "sudo apt-get install --no-install-recommends libegl1 xvfb"
    )


def test_without_apt_the_sentence_names_no_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.which", lambda _name: None)
    with pytest.raises(programs.SetUpError, match=r"Xvfb\. Install it with this system's package"):
        system_packages.require("a window", {"Xvfb": "xvfb"})


@pytest.mark.parametrize("missing", [{}, {"Xvfb": "xvfb"}])
def test_nothing_is_installed_when_nothing_is_missing_or_apt_is(
    missing: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    ran: list[object] = []
    monkeypatch.setattr(system_packages, "run_quietly", lambda *command, **_: ran.append(command))
    if missing:
        monkeypatch.setattr("shutil.which", lambda _name: None)
    system_packages.install_missing(missing)
    assert ran == []


def test_only_what_is_missing_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[list[str]] = []

    def run_quietly(command: list[str], **_options: object) -> bool:
        ran.append(command)
        return True

    monkeypatch.setattr("shutil.which", lambda name: f"/usr/bin/{name}")
    monkeypatch.setattr(system_packages, "_words_to_become_root", list)
    monkeypatch.setattr(system_packages, "run_quietly", run_quietly)
    system_packages.install_missing({"libEGL.so.1": "libegl1", "Xvfb": "xvfb"})
    assert [command[-2:] for command in ran[1:]] == [["libegl1", "xvfb"]]

"""Actions of the window itself: undo, theme, text, layout, palette, pictures of it, scripts."""

from __future__ import annotations

import shlex
from functools import partial
from pathlib import Path
from typing import Protocol

from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QDialog, QWidget

from studio.app.model.actions import Action
from studio.app.model.runs.live_run import LiveRun
from studio.app.model.script import read_script
from studio.app.model.settings import TEXT_SCALES, THEMES
from studio.app.model.workbench import Workbench
from studio.app.shell.docking.docks import DOCKS


class Shell(Protocol):
    """The window, as these actions use it."""

    def show_palette(self) -> None:
        """Show the command palette."""
        ...

    def show_keys(self) -> None:
        """Show the cheat sheet."""
        ...

    def show_first_page(self) -> None:
        """Show how to begin, over the view."""
        ...

    def show_dock(self, dock_id: str) -> None:
        """Show a dock, in front of its tabs."""
        ...

    def save_layout(self, name: str) -> None:
        """Remember the docks' layout by a name."""
        ...

    def load_layout(self, name: str) -> None:
        """Arrange the docks as remembered; "" as in a first window."""
        ...

    def save_picture(self, path: Path) -> None:
        """Write a picture of the whole window."""
        ...

    def film_window(self, path: Path | None) -> None:
        """Begin to write a film of the whole window; None ends it."""
        ...

    def resize_to(self, width_px: int, height_px: int) -> None:
        """Give the window a size."""
        ...

    def close_window(self) -> None:
        """Close it."""
        ...


def add_shell_actions(bench: Workbench, shell: Shell) -> None:
    """Add what the Edit, View and Help menus hold."""
    actions = [*_edit(bench), *_view(bench, shell), *_help(bench, shell)]
    for dock in DOCKS:
        actions.append(
            Action(
                f"dock.{dock.id}",
                f"Show {dock.title}",
                "View",
                partial(shell.show_dock, dock.id),
                dock.hint,
                dock.keys,
            )
        )
    for action in actions:
        bench.actions.add(action)


def _edit(bench: Workbench) -> list[Action]:
    return [
        Action(
            "edit.undo",
            "Undo",
            "Edit",
            bench.history.undo,
            "take the last change back",
            "Ctrl+Z",
            available=lambda: bool(bench.history.undoes),
            icon="mdi6.undo",
            says=lambda: f"Undo: {bench.history.undoes}" if bench.history.undoes else "Undo",
        ),
        Action(
            "edit.redo",
            "Redo",
            "Edit",
            bench.history.redo,
            "make it again",
            "Ctrl+Shift+Z",
            available=lambda: bool(bench.history.redoes),
            icon="mdi6.redo",
            says=lambda: f"Redo: {bench.history.redoes}" if bench.history.redoes else "Redo",
        ),
        Action(
            "edit.copy_command",
            "Copy as command",
            "Edit",
            partial(_copy_command, bench),
            "the command line that rehearses what is open, or an action's own",
            "Ctrl+Shift+C",
            ("action",),
        ),
        Action(
            "script.copy",
            "Copy what I did as a script",
            "Edit",
            partial(_copy_script, bench),
            "every action since the window opened",
        ),
        Action(
            "script.save",
            "Save what I did as a script",
            "Edit",
            partial(_save_script, bench),
            "played again by nexus studio --script FILE",
            arguments=("path",),
        ),
        Action(
            "script.line",
            "Do a line of a script",
            "Edit",
            partial(_run_line, bench),
            "an action with its arguments",
            arguments=("line",),
        ),
    ]


def _view(bench: Workbench, shell: Shell) -> list[Action]:
    def picture(path: str = "") -> None:
        shell.save_picture(Path(path or "studio.png"))

    def film(path: str = "") -> None:
        shell.film_window(Path(path) if path else None)

    def size(width: int, height: int) -> None:
        shell.resize_to(width, height)

    theme, text = partial(_set_theme, bench), partial(_set_text_scale, bench)

    return [
        Action("view.theme", "Dark or light", "View", theme, "", "Ctrl+Shift+L", ("name",)),
        Action("view.text", "Size of text", "View", text, "", arguments=("step", "scale")),
        Action("view.text_bigger", "Bigger text", "View", partial(text, 1), "", "Ctrl++"),
        Action("view.text_smaller", "Smaller text", "View", partial(text, -1), "", "Ctrl+-"),
        Action(
            "layout.save",
            "Save layout",
            "View",
            lambda name="mine": shell.save_layout(name),
            "of docks, by a name",
            arguments=("name",),
        ),
        Action(
            "layout.load",
            "Load layout",
            "View",
            lambda name="mine": shell.load_layout(name),
            "as it was saved",
            arguments=("name",),
        ),
        Action("layout.reset", "First layout", "View", lambda: shell.load_layout(""), ""),
        Action(
            "window.picture",
            "Picture of the window",
            "View",
            picture,
            "a PNG file",
            "Ctrl+Shift+P",
            ("path",),
        ),
        Action(
            "window.film",
            "Film the window",
            "View",
            film,
            "into an MP4 file; without a path, end the film",
            arguments=("path",),
        ),
        Action(
            "window.size", "Size of the window", "View", size, "", arguments=("width", "height")
        ),
    ]


def _copy_script(bench: Workbench) -> None:
    _to_clipboard("\n".join(bench.trace()) + "\n")
    bench.say("info", f"copied {len(bench.trace())} steps: save them, nexus studio --script FILE")


def _save_script(bench: Workbench, path: str) -> None:
    Path(path).write_text("\n".join(bench.trace()) + "\n", encoding="utf-8")
    bench.say("info", f"saved {path}: nexus studio --script {shlex.quote(path)}")


def _copy_command(bench: Workbench, action: str = "") -> None:
    live = bench.shared(LiveRun)
    is_live = live is not None and live.is_running
    action = action or ("live.next" if is_live else "session.rehearse")
    command = bench.actions.get(action).command
    if command is None:
        lines = [line for line in bench.trace() if line.split()[0] == action]
        text = lines[-1] if lines else action
    else:
        text = command()
    _to_clipboard(text)
    bench.say("info", f"copied: {text}")


def _run_line(bench: Workbench, line: str) -> None:
    for step in read_script(line, source="command"):
        bench.perform(step.action_id, **step.values)


def _set_theme(bench: Workbench, name: str = "") -> None:
    other = THEMES[1 - THEMES.index(bench.settings.theme)]
    if name and name not in THEMES:
        raise ValueError(f"theme = {name!r}, wanted one of {', '.join(THEMES)}")
    bench.set(theme=name or other)


def _set_text_scale(bench: Workbench, step: int = 0, scale: float | None = None) -> None:
    place = TEXT_SCALES.index(bench.settings.text_scale)
    wanted = TEXT_SCALES[min(max(place + step, 0), len(TEXT_SCALES) - 1)]
    if scale is not None and scale not in TEXT_SCALES:
        raise ValueError(f"scale = {scale!r}, wanted one of {TEXT_SCALES}")
    bench.set(text_scale=wanted if scale is None else scale)


def _help(bench: Workbench, shell: Shell) -> list[Action]:
    return [
        Action(
            "palette.open",
            "Find a command",
            "Help",
            shell.show_palette,
            "every action, by a part of its name",
            "Ctrl+K",
            icon="mdi6.magnify",
        ),
        Action(
            "help.keys",
            "All keys",
            "Help",
            shell.show_keys,
            "",
            "H",
            icon="mdi6.keyboard-outline",
        ),
        Action(
            "help.first_page",
            "First page",
            "Help",
            shell.show_first_page,
            "the ways to begin, and what was opened lately",
        ),
        Action(
            "help.manual",
            "Manual",
            "Help",
            partial(_show, shell, "ManualWindow"),
            "all pages, offline, with a search",
            "F1",
        ),
        Action(
            "help.about",
            "About",
            "Help",
            partial(_show, shell, "AboutWindow"),
            "version, licence, and the libraries with theirs",
        ),
        Action("file.quit", "Quit", "File", shell.close_window, "", "Ctrl+Q"),
    ]


def _show(shell: Shell, kind: str) -> None:
    """Show a window of the Help menu, the one that is there if it is open."""
    from studio.app.shell import help_pages  # not before somebody wants to read

    over = shell if isinstance(shell, QWidget) else None
    make: type[QDialog] = getattr(help_pages, kind)
    window = None if over is None else over.findChild(make)
    if window is None:
        window = make(over)
        window.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    window.show()
    window.raise_()


def _to_clipboard(text: str) -> None:
    QGuiApplication.clipboard().setText(text)

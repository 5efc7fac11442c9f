"""A scene that answers: one page that any browser opens, and the same in a notebook.

- `describe`: what a page knows of a scene, as JSON.
- `page`: `html` and `write`, the page as one file.
- `widget`: the page in a notebook; the only module that needs anywidget.
- ``bundle``: the script of the page and that of the engine's thread, as `tools/build_page.py` makes
  them of the modules.
- ``assets``: HTML, CSS, the catalogues of words, and the modules of TypeScript; each says at its
  top what it is. ``scene.ts``, ``plan.ts`` and ``machine.ts`` make a machine of keys, ``core.ts``
  and ``worker.ts`` run it with the contact engine, in a thread; ``lab.ts`` holds scene and run,
  ``transfer.ts`` and ``prediction.ts`` are the closed form, ``task.ts`` and ``exercise.ts`` a
  lesson's exercise, ``stage.ts`` is the picture, ``bench.ts`` what is done on it, ``palette.ts``
  what it is built of, ``inspector.ts`` what is typed, and ``app.ts`` joins all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from chutelab.scene import AnyScene, Overrides, load, to_toml
from chutelab.util.errors import MissingLibraryError

if TYPE_CHECKING:
    from chutelab.pictures.live.widget import LivePage


def live(
    scene: AnyScene,
    overrides: Overrides = (),
    *,
    height: int = 640,
    language: str = "en",
) -> LivePage:
    """Show a scene in a notebook as a page that answers: drag the plate, and all else follows.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        What `chutelab.load` takes.
    overrides : mapping, str, or several
        Laid over it, see `chutelab.load`.
    height : int
        Of the page, in pixels.
    language : {"en", "de"}
        Of what the page says.

    Returns
    -------
    LivePage
        Put it last in a cell to see it. Its `scene` is what the page has made of the scene, TOML
        text for `chutelab.scene.parse`.

    Raises
    ------
    SceneError
        If the scene cannot be used, or has what the contact engine has not.
    MissingLibraryError
        An ImportError, without anywidget.

    Examples
    --------
    >>> import chutelab
    >>> chutelab.live("perpendicular", ["plate.angle_deg=20"])  # doctest: +SKIP
    """
    try:
        from chutelab.pictures.live.widget import LivePage
    except ModuleNotFoundError as error:
        if error.name not in ("anywidget", "traitlets"):
            raise
        text = 'live pages in a notebook need anywidget: python -m pip install "chutelab[notebook]"'
        raise MissingLibraryError(text) from error
    from chutelab.pictures.live.page import html

    scene = load(scene, overrides)
    page = html(scene, language=language)
    return LivePage(html=page, height=height, title=scene.title, scene=to_toml(scene))


__all__ = ["live"]

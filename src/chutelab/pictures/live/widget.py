"""The live page in a notebook: an anywidget that is a frame with the page in it."""

from __future__ import annotations

import anywidget
import traitlets

SHOWN = """
export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.title = model.get("title");
    // An origin of its own: the page has no way to the notebook but its messages.
    frame.setAttribute("sandbox", "allow-scripts allow-downloads");
    frame.style.cssText = "display: block; width: 100%; border: 0";
    const fill = () => { frame.srcdoc = model.get("html"); };
    const grow = () => { frame.style.height = `${model.get("height")}px`; };
    const hear = ({ source, data }) => {
      if (source !== frame.contentWindow || data?.chutelab !== "scene") return;
      if (typeof data.toml !== "string") return;
      model.set("scene", data.toml);
      model.save_changes();
    };
    fill();
    grow();
    model.on("change:html", fill);
    model.on("change:height", grow);
    addEventListener("message", hear);
    el.append(frame);
    return () => {
      removeEventListener("message", hear);
      model.off("change:html", fill);
      model.off("change:height", grow);
    };
  },
};
"""


class LivePage(anywidget.AnyWidget):
    """A live page in a notebook.

    The page tells what it changed by ``parent.postMessage({chutelab: "scene", toml}, "*")``.

    Attributes
    ----------
    html : str
        The page.
    height : int
        Of the frame, in pixels.
    title : str
        What the frame is called for those who do not see it.
    scene : str
        The scene as it is in the page now, TOML text; `chutelab.scene.parse` makes a scene of it.
    """

    _esm = SHOWN
    html = traitlets.Unicode().tag(sync=True)
    height = traitlets.Int(min=1).tag(sync=True)
    title = traitlets.Unicode().tag(sync=True)
    scene = traitlets.Unicode().tag(sync=True)

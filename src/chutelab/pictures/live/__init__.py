"""A scene that answers: one page that any browser opens, and the same in a notebook.

- `describe`: what a page knows of a scene, as JSON.
- `page`: `html` and `write`, the page as one file.
- `widget`: the page in a notebook; the only module that needs anywidget.
- ``assets``: HTML, CSS, the catalogues of words, and the modules of JavaScript. Without a screen:
  ``trig.js``, ``random.js``, ``scene.js``, ``machine.js`` (keys become surfaces), ``transfer.js``
  (the closed form), ``core.js`` and ``worker.js`` (the contact engine in its thread),
  ``engine.js``, ``recording.js``, ``lab.js``, ``handles.js``, ``view.js``, ``words.js``. With one:
  ``stage.js``, ``transport.js`` and ``app.js``, which joins all.
"""

// A live page runs from when its place is opened, so that a gallery of them costs nothing before.
for (const play of document.querySelectorAll("details.play")) {
  play.addEventListener("toggle", () => {
    const frame = play.querySelector("iframe");
    frame.src ||= frame.dataset.page;
  });
}

// A live page runs from when its place is opened, so that a gallery of them costs nothing before.
for (const play of document.querySelectorAll("details.play")) {
  play.addEventListener("toggle", () => {
    const frame = play.querySelector("iframe");
    frame.src ||= frame.dataset.page;
  });
}
// A picture of the gallery moves while the pointer is on it or its link has the focus, and where
// motion is not wanted only when the link is pressed.
const unwanted = matchMedia("(prefers-reduced-motion: reduce)");
for (const link of document.querySelectorAll("a.film")) {
  const picture = link.closest("section").querySelector("img"), { src } = picture;
  const start = link.textContent;
  const show = (moves) => {
    picture.src = moves ? link.href : src;
    link.textContent = moves ? link.dataset.stop : start;
    link.setAttribute("aria-pressed", moves);
  };
  link.setAttribute("role", "button");
  show(false);
  picture.addEventListener("pointerenter", ({ pointerType }) => {
    if (pointerType === "mouse" && !unwanted.matches) show(true);
  });
  picture.addEventListener("pointerleave", () => show(false));
  link.addEventListener("focus", () => {
    if (link.matches(":focus-visible") && !unwanted.matches) show(true);
  });
  link.addEventListener("blur", () => show(false));
  const press = (event) => {
    event.preventDefault();
    show(link.getAttribute("aria-pressed") === "false");
  };
  link.addEventListener("click", press);
  link.addEventListener("keydown", (event) => {
    if (event.key === " ") press(event);
  });
}

// Stops the animation, and starts it again from the beginning: nothing that moves without end
// should move against a reader's will.
(() => {
  "use strict";
  const image = document.querySelector("#picture img");
  const calm = document.querySelector("#picture source");
  const button = document.getElementById("pause");
  if (!image || !button) return;
  const moving = image.getAttribute("src");
  let runs = !window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  const show = () => {
    if (calm) calm.remove();
    image.src = runs ? moving : image.dataset.still;
    say();
  };
  const say = () => {
    button.textContent = runs ? button.dataset.stop : button.dataset.start;
  };
  button.hidden = false;
  say();
  button.addEventListener("click", () => {
    runs = !runs;
    show();
  });
})();

// Plays the film and stops it again. It begins when it is asked to: whoever predicts has not seen
// it, and nothing that moves without end should move against a reader's will.
(() => {
  "use strict";
  const image = document.querySelector("#picture");
  const button = document.getElementById("play");
  if (!image || !button) return;
  const still = image.getAttribute("src");
  let runs = false;
  button.hidden = false;
  button.addEventListener("click", () => {
    runs = !runs;
    image.src = runs ? image.dataset.film : still;
    button.textContent = runs ? button.dataset.stop : button.dataset.start;
  });
})();

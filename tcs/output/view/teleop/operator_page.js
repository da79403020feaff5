"use strict";

// Camera pictures: each is loaded again when the one before has arrived.
const PICTURE_INTERVAL = 150; // ms; the pictures are rendered at most five times a second
const PICTURE_OLD = 3000; // ms without a reply after which the caption says so

function showCamera(box, name, number) {
  const figure = document.createElement("figure");
  const image = document.createElement("img");
  const caption = document.createElement("figcaption");
  image.alt = name;
  caption.textContent = name;
  figure.append(caption, image);
  box.append(figure);
  let arrived = performance.now();
  const next = () => {
    image.src = `camera/${number}?${performance.now()}`;
  };
  image.onload = () => {
    arrived = performance.now();
    setTimeout(next, PICTURE_INTERVAL);
  };
  image.onerror = () => setTimeout(next, 1000);
  setInterval(() => {
    const old = performance.now() - arrived > PICTURE_OLD;
    figure.classList.toggle("old", old);
    caption.textContent = old ? `${name}: no picture arrives` : name;
  }, 500);
  next();
}

async function showCameras() {
  const box = document.createElement("div");
  box.id = "cameras";
  document.body.append(box);
  const waiting = document.createElement("figure");
  waiting.innerHTML = "<figcaption>camera pictures: the robot is loaded</figcaption>";
  box.append(waiting);
  for (;;) {
    const names = await fetch("cameras")
      .then((reply) => reply.json())
      .catch(() => []);
    if (names.length) {
      waiting.remove();
      names.forEach((name, number) => showCamera(box, name, number));
      return;
    }
    await new Promise((done) => setTimeout(done, 500));
  }
}

if (TCS.cameras) showCameras();

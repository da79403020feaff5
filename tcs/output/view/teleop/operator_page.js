"use strict";

// Camera pictures: each is loaded again when the one before has arrived.
const PICTURE_INTERVAL = 150; // ms; the pictures are rendered at most five times a second
const PICTURE_OLD = 3000; // ms without a reply after which the caption says so

function showCamera(box, name, number) {
  const figure = document.createElement("figure");
  const image = document.createElement("img");
  const caption = document.createElement("figcaption");
  const enlarge = element("button", { type: "button", "aria-pressed": "false" }, image);
  image.alt = `${name}, large or small`;
  caption.textContent = name;
  figure.append(caption, enlarge);
  box.append(figure);
  enlarge.addEventListener("click", () => {
    // One at a time.
    for (const other of box.children) {
      const isLarge = other === figure && !other.classList.contains("large");
      other.classList.toggle("large", isLarge);
      other.querySelector("button").setAttribute("aria-pressed", isLarge);
    }
  });
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

// XR controller: while a session runs, its pose is sent in place of a gamepad: number of the frame,
// position and quaternion (xyzw) with z up, trigger and side button.
function sendDevice(now) {
  device = now;
  wake();
}

function rightController(session) {
  const tracked = [...session.inputSources].filter((one) => one.gamepad);
  return tracked.find((one) => one.handedness === "right") || tracked[0];
}

function poseOf(frame, source) {
  const space = viewer.renderer.xr.getReferenceSpace();
  const pose = space && source && frame.getPose(source.gripSpace || source.targetRaySpace, space);
  // A pose that the headset guesses is none.
  if (!pose || pose.emulatedPosition) return null;
  const p = pose.transform.position;
  const q = pose.transform.orientation;
  // XR has y up and z back, the robot z up.
  return [p.x, -p.z, p.y, q.x, -q.z, q.y, q.w];
}

function driveBySession(session) {
  let number = 0;
  let running = true;
  const onFrame = (_, frame) => {
    if (!running) return;
    session.requestAnimationFrame(onFrame);
    const source = rightController(session);
    const pose = session.visibilityState === "visible" ? poseOf(frame, source) : null;
    if (!pose) {
      sendDevice({});
      return;
    }
    number += 1;
    const buttons = source.gamepad.buttons;
    const values = [0, 1].map((i) => (buttons[i] ? buttons[i].value : 0));
    sendDevice({ index: TCS.xr, button_values: values, axes: [number, ...pose] });
  };
  session.requestAnimationFrame(onFrame);
  session.addEventListener("end", () => {
    running = false;
    sendDevice(null);
  });
}

function offerXr() {
  if (!navigator.xr) {
    const note = document.createElement("p");
    note.id = "xr";
    note.textContent = "This browser has no WebXR; keys, sliders and gamepad work.";
    document.body.append(note);
    return;
  }
  // Meshcat adds its button that starts a session, and shows the scene in the headset.
  viewer.handle_command({ type: "enable_webxr", mode: "vr" });
  viewer.renderer.xr.addEventListener("sessionstart", () => {
    driveBySession(viewer.renderer.xr.getSession());
  });
}

if (TCS.xr !== null) offerXr();

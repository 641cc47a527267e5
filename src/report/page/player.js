// Plays the footage and the animated rig in step. All data stand in the page.
(() => {
  const section = document.getElementById("player");
  if (!section) return;
  const part = (name) => section.querySelector(`[data-part="${name}"]`);
  const data = JSON.parse(document.getElementById("player-data").textContent);
  const duration = data.frames / data.fps;
  const state = { time: 0, playing: false, speed: 1, last: 0 };

  const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const frameNow = () => Math.min(Math.floor(state.time * data.fps + 1e-6), data.frames - 1);

  // The footage with the outline, or the silhouette alone.
  const footage = part("footage");
  const sharpness = 2;
  footage.width = data.size[0] * sharpness;
  footage.height = data.size[1] * sharpness;
  const paint = footage.getContext("2d");
  const pictures = data.pictures.map((address) => {
    const image = new Image();
    image.onload = () => { if (pictures[Math.floor(frameNow() / data.step)] === image) draw(); };
    image.src = address;
    return image;
  });

  function drawFootage(frame) {
    const kept = Math.floor(frame / data.step);
    const picture = pictures[kept];
    const outline = new Path2D(data.outlines[kept]);
    paint.setTransform(sharpness, 0, 0, sharpness, 0, 0);
    paint.fillStyle = "#dfe4ea";
    paint.fillRect(0, 0, ...data.size);
    paint.lineJoin = "round";
    if (picture && picture.complete && picture.naturalWidth) {
      paint.drawImage(picture, 0, 0, ...data.size);
    } else {
      paint.fillStyle = "#1f2933";
      paint.fill(outline, "evenodd");
    }
    if (!part("outline").checked) return;
    paint.translate(0.5, 0.5);
    for (const [colour, width] of [["rgba(16, 24, 32, 0.6)", 3.4], ["#19e0ff", 1.6]]) {
      paint.strokeStyle = colour;
      paint.lineWidth = width;
      paint.stroke(outline);
    }
  }

  // The animation's time: that of the footage, or round and round for a loop.
  function animationTime() {
    const { duration: length, start, retime, looped } = data.animation;
    const time = Math.max(0, state.time - start) / retime;
    return looped && length > 0 ? time % length : Math.min(time, length);
  }

  let viewer = null;
  const canvas = part("rig");
  if (canvas) {
    try {
      viewer = new RigViewer(canvas, bytesOf(data.rig.glb), data.rig);
    } catch (error) {
      canvas.hidden = true;
      part("views").hidden = true;
      part("no-rig").hidden = false;
      part("no-rig").textContent = `The rig cannot be shown here: ${error.message}. The footage plays without it.`;
    }
  }

  function fitRig() {
    if (!viewer) return;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  }

  function draw() {
    const frame = frameNow();
    drawFootage(frame);
    if (viewer) viewer.draw(animationTime());
    const words = `frame ${frame} · ${(frame / data.fps).toFixed(2)} s`;
    part("scrub").value = frame;
    part("scrub").setAttribute("aria-valuetext", words);
    part("moment").textContent = words;
    section.querySelectorAll("[data-key-frame]").forEach((chip) => {
      chip.setAttribute("aria-current", Number(chip.dataset.keyFrame) === frame);
    });
  }

  function tick(now) {
    if (!state.playing) return;
    state.time = (state.time + state.speed * (now - state.last) / 1000) % duration;
    state.last = now;
    draw();
    requestAnimationFrame(tick);
  }

  function play(on) {
    state.playing = on;
    part("play").textContent = on ? "Pause" : "Play";
    if (!on) return;
    requestAnimationFrame((now) => {
      state.last = now;
      tick(now);
    });
  }

  function seek(frame) {
    play(false);
    state.time = Math.max(0, Math.min(frame, data.frames - 1)) / data.fps;
    draw();
  }

  part("play").addEventListener("click", () => play(!state.playing));
  part("back").addEventListener("click", () => seek(frameNow() - 1));
  part("forward").addEventListener("click", () => seek(frameNow() + 1));
  part("scrub").addEventListener("input", (event) => seek(Number(event.target.value)));
  part("speed").addEventListener("change", (event) => { state.speed = Number(event.target.value); });
  part("outline").addEventListener("change", draw);
  section.querySelectorAll("[data-key-frame]").forEach((chip) => {
    chip.addEventListener("click", () => seek(Number(chip.dataset.keyFrame)));
  });

  section.addEventListener("keydown", (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const { target, key } = event;
    if (target === canvas && turnByKey(key)) {
      event.preventDefault();
      return;
    }
    const own = target.matches("select") || (target.matches("button, [type=checkbox]") && key === " ");
    const scrubbing = target.matches("[type=range]");
    const actions = { " ": () => play(!state.playing) };
    if (!scrubbing) {
      actions.ArrowLeft = () => seek(frameNow() - 1);
      actions.ArrowRight = () => seek(frameNow() + 1);
      actions.Home = () => seek(0);
      actions.End = () => seek(data.frames - 1);
    }
    if (own || !actions[key]) return;
    event.preventDefault();
    actions[key]();
  });

  // The viewer's camera.
  function look(change) {
    if (!viewer) return;
    const now = Object.assign(viewer.look, change);
    now.pitch = Math.max(-1.5, Math.min(1.5, now.pitch));
    now.zoom = Math.max(0.2, Math.min(4, now.zoom));
    draw();
  }

  function turnByKey(key) {
    if (!viewer) return false;
    const { yaw, pitch, zoom } = viewer.look;
    const changes = {
      ArrowLeft: { yaw: yaw - 0.15 }, ArrowRight: { yaw: yaw + 0.15 },
      ArrowUp: { pitch: pitch + 0.1 }, ArrowDown: { pitch: pitch - 0.1 },
      "+": { zoom: zoom / 1.15 }, "=": { zoom: zoom / 1.15 }, "-": { zoom: zoom * 1.15 },
    };
    if (changes[key]) look(changes[key]);
    return Boolean(changes[key]);
  }

  if (viewer) {
    const views = { side: SIDE, front: { ...SIDE, yaw: data.rig.heading * Math.PI / 2 }, corner: { yaw: data.rig.heading * 0.7, pitch: 0.3, zoom: 1.05 } };
    section.querySelectorAll("[data-view]").forEach((button) => {
      button.addEventListener("click", () => look(views[button.dataset.view]));
    });
    let held = null;
    canvas.addEventListener("pointerdown", (event) => {
      held = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      const [x, y] = held;
      held = [event.clientX, event.clientY];
      look({ yaw: viewer.look.yaw - (event.clientX - x) * 0.01, pitch: viewer.look.pitch + (event.clientY - y) * 0.01 });
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, () => { held = null; });
    canvas.addEventListener("wheel", (event) => {
      // The wheel scrolls the page until the picture was clicked or reached by the keyboard.
      if (document.activeElement !== canvas) return;
      event.preventDefault();
      look({ zoom: viewer.look.zoom * Math.exp(event.deltaY * 0.001) });
    }, { passive: false });
    canvas.addEventListener("webglcontextlost", () => { play(false); viewer = null; });
    new ResizeObserver(() => { fitRig(); draw(); }).observe(canvas);
  }
  fitRig();
  draw();
})();

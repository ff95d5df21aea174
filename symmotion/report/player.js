"use strict";
// A player in every figure that brings a motion: the script replaces the still picture, which print still shows.
(() => {
  const calm = matchMedia("(prefers-reduced-motion: reduce)");
  const bodies = JSON.parse(document.getElementById("bodies").textContent);
  const STEPS = 200; // of the slider
  const { clamp, mix, css, rgb, hex, poseAt, carry, projection, light, camera } = scene;

  function element(tag, properties = {}, ...children) {
    const made = document.createElement(tag);
    for (const [key, value] of Object.entries(properties)) {
      if (key in made) made[key] = value; else made.setAttribute(key, value);
    }
    made.append(...children);
    return made;
  }

  function start(figure, index) {
    const data = JSON.parse(figure.querySelector("script").textContent);
    const body = bodies[data.body], d = data.dimension, tracks = data.tracks, [begin, end] = data.domain;
    const home = [Math.atan2(data.direction[1], data.direction[0]),
      Math.atan2(data.direction[2], Math.hypot(data.direction[0], data.direction[1]))];
    const digits = clamp(2 - Math.floor(Math.log10(end - begin)), 0, 12);
    const seconds = data.unit === "s" ? clamp(end - begin, 3, 12) : 6;
    let t = begin, shown = 0, playing = false, visible = false, stale = true, last = 0; // stale: a frame is asked for
    let all = false; // whether the whole path is shown where the camera would follow the body
    let [yaw, pitch] = home;
    const paths = tracks.map((track) => {
      const steps = 4 * Math.max(30, track.times.length);
      return Array.from({ length: steps + 1 }, (_, k) => carry(poseAt(track, begin + (k / steps) * (end - begin)), data.centre));
    });
    const { follows, ratio, places } = camera(data, body.corners, projection(d, yaw, pitch));
    const chosen = () => (shown < tracks.length ? [tracks[shown]] : tracks);

    // The controls.
    const name = data.name;
    const canvas = element("canvas", { role: "img", "aria-label": data.alt });
    const play = element("button", { type: "button", className: "play" });
    const scrub = element("input", { type: "range", max: STEPS, step: 1, value: 0, "aria-label": `Time, ${name}` });
    const clock = element("output", { "aria-live": "off" });
    const more = element("div", {}), key = element("span", { className: "key" });
    const controls = element("div", { className: "controls", role: "group", "aria-label": `Player, ${name}` },
      element("div", {}, play, scrub, clock), more);
    if (tracks.length === 2) {
      const choice = element("fieldset", {}, element("legend", { textContent: "Before or after" }));
      [...tracks.map((track) => track.label), "both"].forEach((label, k) => {
        const input = element("input", { type: "radio", name: `track-${index}`, value: k, checked: k === shown });
        input.addEventListener("change", () => choose(k));
        choice.append(element("label", {}, input, " ", ...swatch(k), label));
      });
      more.append(choice);
    } else if (tracks.length > 2) {
      const choice = element("select", { "aria-label": `Motion, ${name}` });
      choice.append(...[...tracks.map((track) => track.label), "all"].map((label, k) =>
        element("option", { value: k, textContent: label, selected: k === shown })));
      choice.addEventListener("change", () => choose(Number(choice.value)));
      more.append(choice, key);
    }
    const still = element("button", { type: "button", textContent: "Still picture", "aria-pressed": "false" });
    const views = element("span", { className: "views" }, still);
    if (d === 3) {
      canvas.tabIndex = 0;
      canvas.setAttribute("aria-label", `${data.alt} Arrow keys turn the view.`);
      const reset = element("button", { type: "button", className: "reset", textContent: "Reset view" });
      reset.addEventListener("click", () => turn(home[0] - yaw, home[1] - pitch));
      views.prepend(reset);
    }
    more.append(views);
    figure.querySelector(".box").after(element("div", { className: "stage" }, canvas), controls);
    figure.querySelector("figcaption").append(element("span", { textContent: data.caption }));
    figure.classList.add("moving");

    function swatch(k) {
      if (k >= tracks.length) return [];
      const made = element("i", { className: "swatch" });
      made.style.background = tracks[k].colour;
      return [made];
    }
    // Of several bodies at once, which colour is which; one alone is named by the choice.
    function explain() {
      const all = shown >= tracks.length;
      key.replaceChildren(...(all ? tracks.map((track, k) => element("span", {}, ...swatch(k), track.label)) : swatch(shown)));
    }
    function choose(k) {
      shown = k;
      explain();
      picture(false);
      refresh();
    }
    function picture(on) {
      still.setAttribute("aria-pressed", on);
      figure.classList.toggle("moving", !on);
    }
    function seek(time) {
      t = clamp(time, begin, end);
      picture(false);
      refresh();
    }
    function turn(left, up) {
      yaw += left;
      pitch = clamp(pitch + up, -Math.PI / 2, Math.PI / 2);
      refresh();
    }
    function toggle(on = !playing) {
      playing = on;
      if (on && t >= end) t = begin;
      if (on) picture(false);
      last = 0;
      label();
      refresh();
    }
    function label() {
      play.textContent = playing ? "❚❚ Pause" : "▶ Play";
      play.setAttribute("aria-label", `${playing ? "Pause" : "Play"}, ${name}`);
    }

    // What is shown follows the state at the next frame; out of sight it is drawn once, so that nobody meets it blank.
    function refresh() {
      if (!stale) requestAnimationFrame(frame);
      stale = true;
    }
    function frame(now) {
      stale = false;
      if (playing && visible) {
        if (last) t += ((now - last) / 1000 / seconds) * (end - begin);
        last = now;
        if (t > end && calm.matches) toggle(false);
        t = t > end ? (calm.matches ? end : begin) : t;
        refresh();
      }
      if (visible || !canvas.dataset.drawn) draw();
    }
    function say(poses) {
      const unit = data.unit ? ` ${data.unit}` : "";
      const centre = carry(poses[0], data.centre).map((x) => Number(x.toPrecision(3)));
      scrub.value = Math.round(((t - begin) / (end - begin)) * STEPS);
      clock.textContent = `${(t - data.start).toFixed(digits)}${unit}`;
      scrub.setAttribute("aria-valuetext", `${clock.textContent}, body at ${centre.join(", ")}`);
      Object.assign(figure.dataset, { time: t, pose: poses[0].join(" "), view: `${yaw} ${pitch}`, playing });
    }

    function draw() {
      const context = canvas.getContext("2d"), poses = chosen().map((track) => poseAt(track, t));
      const project = projection(d, yaw, pitch), width = canvas.clientWidth, height = canvas.clientHeight;
      say(poses);
      if (!width) return;
      canvas.dataset.drawn = true;
      const sharp = window.devicePixelRatio || 1;
      canvas.width = Math.round(width * sharp);
      canvas.height = Math.round(height * sharp);
      context.scale(sharp, sharp);
      context.lineJoin = "round";
      const place = places(project, `${yaw} ${pitch}`, width, height, t, all);
      const ink = rgb(getComputedStyle(figure).color), paper = rgb(getComputedStyle(document.body).backgroundColor);
      const trace = (points, close) => {
        context.beginPath();
        points.forEach((p, i) => context[i ? "lineTo" : "moveTo"](...p));
        if (close) context.closePath();
      };
      for (const path of shown < tracks.length ? [paths[shown]] : paths) {
        trace(path.map((point) => place(project(point))));
        context.strokeStyle = css(ink, 0.55);
        context.lineWidth = 1;
        context.stroke();
      }
      // Painter's order: what is far first; in the plane the keyframes, then the bodies.
      const faces = [];
      const add = (pose, colour, ghost) => {
        const seen = body.corners.map((p) => project(carry(pose, p)));
        for (const face of body.faces) {
          const points = face.map((i) => seen[i]);
          faces.push({ points, colour, ghost, depth: points.reduce((sum, p) => sum + p[2], 0) / points.length });
        }
      };
      data.keyframes.forEach((pose) => add(pose, ink, true));
      poses.forEach((pose, k) => add(pose, hex(chosen()[k].colour), false));
      const faint = data.keyframes.length > 8 ? 0.5 : 1, fine = body.faces.length > 24;
      const solid = poses.length > 1 ? 0.6 : d === 3 ? 1 : 0.85;
      faces.sort((a, b) => a.depth - b.depth);
      for (const { points, colour, ghost } of faces) {
        const lit = d === 3 ? light(points) : 1;
        const lift = (lit > 0.6 ? 0.55 : 0.5) * Math.abs(lit - 0.6);
        const shade = d === 2 ? colour : mix(colour, lit > 0.6 ? [255, 255, 255] : [0, 0, 0], lift);
        trace(points.map(place), true);
        context.fillStyle = ghost ? css(mix(paper, ink, 0.25 + 0.35 * (1 - lit)), 0.33 * faint) : css(shade, solid);
        context.fill();
        // Edges of few faces are drawn; those of many only close the gaps between them.
        const edge = fine || d === 2 ? shade : mix(shade, [0, 0, 0], 0.35);
        context.lineWidth = fine ? 0.5 : 1;
        context.strokeStyle = ghost ? css(ink, 0.4 * faint) : css(edge, fine ? solid : 1);
        if (!(ghost && fine)) context.stroke();
      }
      for (const pose of poses) {
        context.beginPath();
        context.arc(...place(project(carry(pose, data.centre))), 2.5, 0, 7);
        context.fillStyle = css(ink);
        context.fill();
      }
    }

    // What the reader does.
    play.addEventListener("click", () => toggle());
    scrub.addEventListener("input", () => seek(begin + (scrub.value / STEPS) * (end - begin)));
    scrub.addEventListener("pointerdown", () => toggle(false));
    still.addEventListener("click", () => {
      toggle(false);
      picture(figure.classList.contains("moving"));
      refresh();
    });
    figure.addEventListener("keydown", (event) => {
      if (event.key === " " && (event.target === scrub || event.target === canvas)) {
        event.preventDefault();
        toggle();
      }
    });
    if (d === 3) {
      const keys = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
      canvas.addEventListener("keydown", (event) => {
        if (!keys[event.key]) return;
        event.preventDefault();
        turn(...keys[event.key]);
      });
      let held;
      canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        held = event;
      });
      canvas.addEventListener("pointermove", (event) => {
        if (!canvas.hasPointerCapture(event.pointerId)) return;
        turn((held.clientX - event.clientX) * 0.01, (event.clientY - held.clientY) * 0.01);
        held = event;
      });
    }
    if (follows) {
      const whole = element("button", { type: "button", textContent: "Whole path", "aria-pressed": "false" });
      whole.addEventListener("click", () => {
        all = !all;
        whole.setAttribute("aria-pressed", all);
        picture(false);
        refresh();
      });
      views.prepend(whole);
    }
    canvas.style.aspectRatio = String(1 / ratio);
    new ResizeObserver(refresh).observe(canvas);
    new IntersectionObserver(([entry]) => {
      visible = entry.isIntersecting;
      last = 0;
      refresh();
    }).observe(figure);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", refresh);
    // Of pages whose readers choose between light and dark.
    new MutationObserver(refresh).observe(document.body, { attributes: true });
    label();
    explain();
    say(chosen().map((track) => poseAt(track, t)));
    stale = false;
    refresh();
  }

  document.querySelectorAll("figure.player").forEach(start);
})();

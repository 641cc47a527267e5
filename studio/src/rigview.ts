// A rig in 3D: loaded, shown at a time of one of its clips, orbited.

import * as three from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

import * as api from "./api";
import { button, coalesced, h } from "./dom";

/** From which side rigs were looked at last, radians about the vertical. */
let facing = 0;

export class RigView {
  readonly canvas = h("canvas", { className: "rig", tabIndex: 0, role: "img", "aria-label": "The rig" });
  readonly element = h(
    "div",
    { className: "picture" },
    this.canvas,
    h(
      "div",
      { className: "zoomer", role: "group", "aria-label": "View of the rig" },
      button("Side", () => this.side(0)),
      button("Other side", () => this.side(Math.PI)),
      button("Corner", () => this.side(0.7)),
    ),
  );
  clips: three.AnimationClip[] = [];
  /** Called when the user turns the rig. */
  onTurn: (() => void) | null = null;
  private readonly renderer: three.WebGLRenderer | null;
  private readonly scene = new three.Scene();
  private readonly camera = new three.PerspectiveCamera(30, 1, 0.01, 5000);
  private controls: OrbitControls | null = null;
  private mixer: three.AnimationMixer | null = null;
  private model: three.Object3D | null = null;
  private readonly observer: ResizeObserver;
  private placed = false;
  readonly redraw = coalesced(() => this.draw());

  constructor() {
    this.renderer = this.begin();
    this.scene.add(new three.HemisphereLight(0xffffff, 0x556070, 2.2));
    const sun = new three.DirectionalLight(0xffffff, 2);
    sun.position.set(3, 5, 4);
    this.scene.add(sun);
    this.observer = new ResizeObserver(([entry]) => {
      const { width, height } = entry!.contentRect;
      if (width === 0 || height === 0) return;
      this.renderer?.setPixelRatio(devicePixelRatio);
      this.renderer?.setSize(width, height, false);
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      if (this.placed) this.side();
      this.draw();
    });
    this.observer.observe(this.canvas);
  }

  private begin(): three.WebGLRenderer | null {
    try {
      const renderer = new three.WebGLRenderer({
        canvas: this.canvas,
        antialias: true,
        alpha: true,
        preserveDrawingBuffer: true,
      });
      this.controls = new OrbitControls(this.camera, this.canvas);
      this.controls.addEventListener("change", () => {
        this.redraw();
        this.onTurn?.();
      });
      return renderer;
    } catch {
      this.canvas.setAttribute("aria-label", "This browser has no WebGL, so the rig cannot be shown");
      return null;
    }
  }

  /** Loads a file; `beside` gives the address of a file that it names. */
  async load(url: string, beside: (name: string) => string): Promise<void> {
    const manager = new three.LoadingManager();
    const own = new Set([url]);
    manager.setURLModifier((address) =>
      own.has(address) || /^(blob|data):/.test(address) ? address : beside(address),
    );
    const loaded = await new GLTFLoader(manager).parseAsync(await api.bytes(url), "");
    this.clear();
    this.model = loaded.scene;
    this.clips = loaded.animations;
    this.scene.add(loaded.scene);
    loaded.scene.traverse((node) => {
      // Bounds of the bind pose would hide a moved mesh.
      node.frustumCulled = false;
    });
    this.mixer = new three.AnimationMixer(loaded.scene);
    this.side();
    this.placed = true;
  }

  private clear(): void {
    if (this.model) this.scene.remove(this.model);
    this.mixer?.stopAllAction();
    this.model = null;
    this.mixer = null;
  }

  /** Shows the clip of a name at a time, seconds. */
  pose(clip: string, time: number): void {
    const found = this.clips.find((c) => c.name === clip) ?? this.clips.find((_, at) => `animation ${at}` === clip);
    if (!this.mixer || !found) return this.redraw();
    this.mixer.stopAllAction();
    const action = this.mixer.clipAction(found);
    action.setLoop(three.LoopOnce, 1);
    action.clampWhenFinished = true;
    action.play();
    this.mixer.setTime(Math.min(time, found.duration));
    this.redraw();
  }

  private box(): three.Box3 {
    this.model?.updateMatrixWorld(true);
    return this.model ? new three.Box3().setFromObject(this.model, true) : new three.Box3();
  }

  /** Looks from the side, across the longer horizontal extent, turned about the vertical by some radians. */
  side(turn = facing): void {
    facing = turn;
    const box = this.box();
    if (box.isEmpty()) return;
    const size = box.getSize(new three.Vector3());
    const centre = box.getCenter(new three.Vector3());
    const along = size.x > size.z ? 0 : Math.PI / 2;
    // The field of view is that of the height; a narrow picture needs more distance.
    const wide = Math.max(size.x, size.z) / Math.min(1, this.camera.aspect);
    const distance = (1.2 * Math.max(wide, size.y)) / (2 * Math.tan(Math.PI / 12));
    const angle = along + turn;
    this.camera.position.set(
      centre.x + distance * Math.sin(angle),
      centre.y + 0.04 * distance,
      centre.z + distance * Math.cos(angle),
    );
    this.camera.near = distance / 100;
    this.camera.far = distance * 10;
    this.camera.updateProjectionMatrix();
    this.controls?.target.copy(centre);
    this.controls?.update();
    this.redraw();
  }

  /** From where the rig is looked at, in a word that changes with it. */
  get viewpoint(): string {
    return [...this.camera.position.toArray(), this.canvas.width, this.canvas.height].map((v) => v.toFixed(3)).join();
  }

  /** Draws at once, for who reads the picture. */
  drawNow(): void {
    this.draw();
  }

  private draw(): void {
    this.renderer?.render(this.scene, this.camera);
  }

  end(): void {
    this.observer.disconnect();
    this.controls?.dispose();
    this.clear();
    this.renderer?.dispose();
  }
}

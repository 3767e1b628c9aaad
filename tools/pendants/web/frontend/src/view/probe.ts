// Whether this browser has WebGL, found out on a throwaway canvas: three.js itself would write to
// the console where there is none.

export type Graphics = "none" | "software" | "hardware";

const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

interface Probed {
  getContext(kind: "webgl2"): WebGL2RenderingContext | null;
}

/** Return what draws WebGL here. */
export function probedGraphics(
  canvas: Probed = document.createElement("canvas"),
): Graphics {
  let gl: WebGL2RenderingContext | null = null;
  try {
    gl = canvas.getContext("webgl2");
  } catch {
    return "none"; // a browser that is told to have none may throw
  }
  if (gl === null) return "none";
  const name = rendererName(gl);
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return SOFTWARE.test(name) ? "software" : "hardware";
}

function rendererName(gl: WebGL2RenderingContext): string {
  const plain = String(gl.getParameter(gl.RENDERER));
  // Firefox tells the name there and writes to the console where the extension is asked for.
  if (!/^webkit webgl$/i.test(plain)) return plain;
  const extension = gl.getExtension("WEBGL_debug_renderer_info");
  if (extension === null) return plain;
  return String(gl.getParameter(extension.UNMASKED_RENDERER_WEBGL));
}

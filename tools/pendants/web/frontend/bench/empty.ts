// The least that a page with three.js can be: what the page in three dimensions is measured by.
import { PerspectiveCamera, Scene, WebGLRenderer } from "three";

const renderer = new WebGLRenderer();
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
renderer.render(new Scene(), new PerspectiveCamera());

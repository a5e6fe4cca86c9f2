"""Evidence of the elements: public problems on the meshes that an engineer takes."""

"""What a world is made of: layers, models, bodies, joints and contacts."""

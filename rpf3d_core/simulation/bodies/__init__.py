"""The flight of rigid bodies with a shape: exact free flight, impacts, and short steps while contact lasts."""

"""Study `grip`: grip of controllers, and slip of the object."""
